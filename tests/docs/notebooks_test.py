"""Executes a notebook of docs/how-to/notebooks: PROGRAM SOURCES NAME [--write]. With --write the notebook gets its output.

Status 77: what executes notebooks is not installed.
"""

import os
import sys
from pathlib import Path

try:
    import matplotlib  # noqa: F401
    import nbclient
    import nbformat
    import pandas  # noqa: F401
except ImportError as missing:
    print(f"{missing}: apt-get install python3-nbclient python3-ipykernel python3-pandas python3-matplotlib")
    sys.exit(77)

program, sources, name = sys.argv[1], Path(sys.argv[2]), sys.argv[3]
os.environ["KILOTWIN"] = program
os.environ["PYDEVD_DISABLE_FILE_VALIDATION"] = "1"
os.environ["PYTHONPATH"] = str(sources / "python/src")
file = sources / "docs/how-to/notebooks" / f"{name}.ipynb"
notebook = nbformat.read(file, as_version=4)
try:
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(sources)}}, kernel_name="python3").execute()
except nbclient.exceptions.CellExecutionError as error:
    sys.exit(f"{file}: {error}")
printed = "".join(output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", []))
print(printed)
if "--write" in sys.argv:
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    nbformat.write(notebook, file)
