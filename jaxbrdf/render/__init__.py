"""A small evaluation renderer over any eval, sample and pdf."""
