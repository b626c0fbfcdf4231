"""The Python interface: the same batches as the command line plays, from a script or a notebook.

``running`` is ``cavsumo.run`` and ``cavsumo.run_study``, ``keywords`` converts their arguments to
settings. ``results`` and ``episodes`` are their results, ``display`` shows them in a line and in a
notebook. The command line offers all these computations too. To add a public name: its module in
``cavsumo/__init__``, its line in the table of docs/python.md.
"""
