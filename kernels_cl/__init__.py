"""OpenCL sources, shipped as package data and found through importlib.resources."""
