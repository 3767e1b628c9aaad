"""Which rules of WCAG 2.2 AA a page breaks, as it stands, by axe-core."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from browser.page_rig import Page

AXE = Path("tools/pendants/web/frontend/node_modules/axe-core/axe.min.js")
THEMES = ("dark", "light")
_RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
_OF_COLOURS = ["color-contrast", "link-in-text-block"]
"""Whatever else the rules are about is the same in each theme."""
_ASK = """
const [theme, rules, finish] = arguments;
document.documentElement.dataset.theme = theme;
axe.run({runOnly: rules}).then(told => finish(
  told.violations.map(each => [each.id, each.nodes.map(node => node.target)])));
"""


def broken_rules(page: Page) -> dict[str, list[Any]]:
    """Return each theme's broken rules and what breaks them; skipped aloud without axe-core."""
    if not AXE.is_file():
        pytest.skip("no axe-core: make browser fetches it")
    if not page.run("return 'axe' in window"):
        page.driver.execute_script(AXE.read_text("utf-8"))
    rules = dict(zip(reversed(THEMES), (_OF_COLOURS, _RULES), strict=True))
    found = {
        theme: page.driver.execute_async_script(_ASK, theme, which)
        for theme, which in rules.items()
    }
    return {theme: rules for theme, rules in found.items() if rules}
