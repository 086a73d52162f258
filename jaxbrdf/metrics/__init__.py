"""Errors in BRDF space and on images."""
