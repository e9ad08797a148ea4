"""Sensors: noise, quantisation, bias."""
