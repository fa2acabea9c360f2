"""One number for each of many launches."""
