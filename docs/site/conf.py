"""Sphinx reads this; docs/make_site.py calls it. Notebooks are shown as they were executed, nothing is loaded from elsewhere."""

project = "rotor"
author = "The rotor developers"
project_copyright = author
extensions = ["myst_nb"]
templates_path: list[str] = []
nb_execution_mode = "off"
nb_merge_streams = True
myst_enable_extensions = ["attrs_inline"]
myst_heading_anchors = 4
add_module_names = False
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
toc_object_entries_show_parents = "hide"
html_theme = "furo"
html_title = "rotor"
html_copy_source = False
html_show_sphinx = False
mathjax_path = "none.js"  # there is no formula in need of it, and nothing is loaded from elsewhere
