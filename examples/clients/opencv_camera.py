"""OpenCV's reader of MJPEG over HTTP: `lsds check sensor --client examples.clients.opencv_camera:Client`."""

import cv2


class Client:
    transport = "http"

    def __init__(self, address):
        self.capture = cv2.VideoCapture(address)
        if not self.capture.isOpened():
            raise ConnectionError(f"{address} does not open")

    def read(self):
        fine, image = self.capture.read()
        if not fine:
            raise OSError("no frame")
        return image

    def close(self):
        self.capture.release()
