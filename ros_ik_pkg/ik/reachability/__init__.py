"""Which poses an arm can reach, cell by cell, and where its base stands best."""
