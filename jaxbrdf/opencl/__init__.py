"""Bundles on OpenCL devices."""
