"""Patches of newcomers' changes apply to this tree, and are counted as they are."""

import subprocess

import pytest

from benchmarks.shared.common import ROOT
from benchmarks.wishes.__main__ import FOLDER, counted, wishes

PATCH = """\
diff --git a/tactile/one.py b/tactile/one.py
--- a/tactile/one.py
+++ b/tactile/one.py
@@ -1,2 +1,3 @@
 a
+b
 c
@@ -9,2 +10,2 @@
-d
+e
 f
diff --git a/tactile/two.py b/tactile/two.py
new file mode 100644
--- /dev/null
+++ b/tactile/two.py
@@ -0,0 +1,2 @@
+a
+b
diff --git a/tests/test_two.py b/tests/test_two.py
new file mode 100644
--- /dev/null
+++ b/tests/test_two.py
@@ -0,0 +1 @@
+a
"""


def test_files_and_hunks_are_counted_without_tests() -> None:
    assert counted(PATCH) == {"new_files": 1, "files": 1, "hunks": 2, "lines": 4}


@pytest.mark.parametrize("name", wishes())
def test_a_patch_applies(name: str) -> None:
    command = ["git", "-C", str(ROOT), "apply", "--check", str(FOLDER / f"{name}.patch")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert {path.stem for path in FOLDER.glob("*.patch")} == set(wishes())
