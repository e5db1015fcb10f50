"""Every Python block of docs/taken-out.md runs by itself."""

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "taken-out.md").read_text()
BLOCKS = [(text.split("\n", 1)[0], block) for text in PAGE.split("\n## ")[1:] for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL)]


@pytest.mark.parametrize("block", [block for _, block in BLOCKS], ids=[name for name, _ in BLOCKS])
def test_what_was_taken_out_is_a_few_lines(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "docs/taken-out.md", "exec"), {})
