"""Mathematics that knows nothing of files, models or devices."""
