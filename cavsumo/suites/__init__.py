"""Published catalogues of tests: data, and the cases read from them.

A suite is one TOML file here (``NAME.toml``) or of the user's: tests, the grid of each, and the
programmes of its testers (docs/suites.md). ``files`` finds and reads it, ``cells`` selects its
cases, ``cases`` makes a scenario of each. Nothing here plays a case or looks at its result.
To add one: a file here.
"""
