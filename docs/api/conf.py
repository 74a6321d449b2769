"""Sphinx settings of the API reference; scripts/docs builds it."""

import ros_ik_pkg

project = 'ros_ik_pkg'
author = 'ros_ik_pkg maintainers'
release = version = ros_ik_pkg.__version__
extensions = ['sphinx.ext.autodoc', 'numpydoc']
html_theme = 'alabaster'
autodoc_member_order = 'bysource'
autodoc_typehints = 'none'  # the docstrings state types with shapes and units
numpydoc_class_members_toctree = False
numpydoc_show_class_members = False
