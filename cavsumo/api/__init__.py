"""The Python interface: the same batches as the command line plays, from a script or a notebook.

``running`` is ``cavsumo.run``, ``keywords`` turns its arguments into settings. ``results`` and
``episodes`` are what comes back, ``display`` says either in a line and in a notebook. Nothing is
computed here that the command line does not offer too.
To add a public name: its module in ``cavsumo/__init__``, its line in the table of docs/python.md.
"""
