"""Detectors: does the object slip?"""
