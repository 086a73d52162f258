"""Readers and writers: bytes to plain arrays and back."""
