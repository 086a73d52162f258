"""Spatially varying reference materials and their prefiltering."""
