"""The parts that `Motion` is put together from, each for one kind of question."""
