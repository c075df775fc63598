"""Motion JPEG over HTTP and through a named pipe, like network cameras and mjpg-streamer."""
