"""Run the Python snippets of a page against the installed package: ``run_page.py PAGE``."""

import re
import sys
from pathlib import Path


def main() -> None:
    """Run the snippets in page order; fail if the package comes from a checkout."""
    page = Path(sys.argv[1])
    names: dict[str, object] = {"__name__": page.stem}
    for snippet in re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.M | re.S):
        exec(snippet, names)
    import pam_envs

    assert "site-packages" in pam_envs.__file__, f"{pam_envs.__file__} is not installed"
    print(f"{page.name} runs with Python {sys.version.split()[0]}")


if __name__ == "__main__":
    main()
