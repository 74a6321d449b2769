"""The solver behind the interfaces of other projects; none of them is needed to import this."""
