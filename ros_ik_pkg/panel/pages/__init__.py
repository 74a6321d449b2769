"""The tabs and folders of the page, a module for each; page.py says what a new one needs."""
