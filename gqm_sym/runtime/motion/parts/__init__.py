"""The base classes of `Motion`, each for one kind of question."""
