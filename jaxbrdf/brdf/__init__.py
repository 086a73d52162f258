"""Reference BRDFs: one noun a file, pure eval, sample and pdf."""
