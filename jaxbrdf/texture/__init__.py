"""Interpolated tables: angular textures and the smoothing that preconditions their training."""
