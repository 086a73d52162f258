"""Parameters to bundles."""
