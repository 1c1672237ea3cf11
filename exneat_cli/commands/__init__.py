"""One file per command of `exneat`."""
