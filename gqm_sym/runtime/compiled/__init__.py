"""How functions are compiled, called by address, buffered and spread over threads."""
