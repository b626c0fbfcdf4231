"""JUnit XML of kept tests against an ego: a case for each file."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from cavsumo.kept.regression import ELSEWHERE, ERROR, PASSES, Regression
from cavsumo.report.junit import document, legal, result, totals


def junit_of_kept(found: Sequence[Regression], ego: str) -> str:
    """The whole document: failed, passed, or skipped as the test no longer meets the ego."""
    root = ET.Element("testsuites", name="cavsumo")
    suite = ET.SubElement(root, "testsuite", name=legal(f"kept tests, ego {ego}"))
    for one in found:
        case = ET.SubElement(suite, "testcase", classname="cavsumo.kept", name=legal(one.file.name))
        case.set("time", f"{float(one.row['wall_s'] or 0.0):.3f}")
        told = f"{one.status}: {one.told}"
        if one.status == ELSEWHERE:
            ET.SubElement(case, "skipped", message=legal(told))
        elif one.status == ERROR:
            result(case, "error", told, f"{told}\n{one.sentence}", "error")
        elif one.status != PASSES:
            result(case, "failure", told, f"{told}\n{one.sentence}", one.status)
    totals(suite, suite.iter("testcase"))
    totals(root, root.iter("testcase"))
    return document(root)
