"""Checks .xosc and .xodr files by ASAM's checkers; the results are beside them (.xqar)."""

import sys
from importlib import import_module

CONFIGURATION = """<Config><Param name="InputFile" value="{file}"/>
<CheckerBundle application="{bundle}"><Param name="resultFile" value="{file}.xqar"/></CheckerBundle>
</Config>"""

for file in sys.argv[1:]:
    scenario = file.endswith(".xosc")
    program = "qc_openscenario" if scenario else "qc_opendrive"
    bundle = "xoscBundle" if scenario else "xodrBundle"
    with open(f"{file}.settings.xml", "w", encoding="utf-8") as stream:  # noqa: PTH123
        stream.write(CONFIGURATION.format(file=file, bundle=bundle))
    sys.argv = [program, "-c", f"{file}.settings.xml"]
    import_module(f"{program}.main").main()
