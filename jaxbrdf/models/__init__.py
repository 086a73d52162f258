"""Learned models: one file each, over shared blocks."""
