"""Make a notebook of each example: ``python docs/examples/make_notebooks.py FOLDER [--execute]``.

The scripts are the source; a notebook is never edited. Needs ``pip install ".[examples]"``.
"""

import argparse
from pathlib import Path

import jupytext
import nbformat

HERE = Path(__file__).resolve().parent
SCRIPTS = sorted(path for path in HERE.glob("*.py") if path.read_text("utf-8").startswith("# %%"))


def notebook_of(script):
    """Make the notebook of a script in the percent format."""
    notebook = jupytext.read(script, fmt="py:percent")
    notebook.metadata = {
        "kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}
    }
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number}"  # instead of a random one
    nbformat.validate(notebook)
    return notebook


def execute(notebook):
    """Run a notebook in the folder of the scripts; CellExecutionError if it fails."""
    from nbclient import NotebookClient

    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": HERE}}).execute()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the notebooks go")
    parser.add_argument("--execute", action="store_true", help="run them, with all pictures")
    parser.add_argument("--only", action="append", metavar="NAME", help="such as acrobot")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for script in SCRIPTS:
        if options.only and script.stem not in options.only:
            continue
        notebook = notebook_of(script)
        if options.execute:
            execute(notebook)
        path = options.folder / f"{script.stem}.ipynb"
        nbformat.write(notebook, path)
        print(path)


if __name__ == "__main__":
    main()
