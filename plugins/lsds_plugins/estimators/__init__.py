"""Estimators: how fast does it slip?"""
