"""Statistical and numerical checks that tests and commands share."""
