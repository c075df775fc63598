"""Motion JPEG over HTTP and through a named pipe, as network cameras and mjpg-streamer serve it."""
