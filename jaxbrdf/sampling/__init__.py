"""Warps with their inverses, densities, and multiple importance sampling."""
