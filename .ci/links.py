"""Links of the documentation to the world: `python .ci/links.py`, with the group `docs`.

Sphinx's link check, of which only an answer counts: a page that is gone fails, a machine without a
network, or a server that refuses robots, does not, and is listed.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
# answers that say that there is no such page, or no such place in it
GONE = ("404", "410", "Anchor")


def main() -> int:
    """Check all links; 1 if one is dead."""
    with tempfile.TemporaryDirectory() as folder:
        # tutorials are not run for it
        options = ["-q", "-b", "linkcheck", "-D", "nb_execution_mode=off"]
        command = [sys.executable, "-m", "sphinx", *options, str(ROOT / "docs"), folder]
        subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        answers = Path(folder) / "output.json"
        if not answers.is_file():
            print("links: Sphinx wrote no answers; see `sphinx-build -b linkcheck docs FOLDER`")
            return 1
        found = [json.loads(line) for line in answers.read_text().splitlines()]
    broken = [link for link in found if link["status"] in ("broken", "timeout")]
    dead = [link for link in broken if any(word in link["info"] for word in GONE)]
    for link in broken:
        kind = "dead" if link in dead else "no answer"
        print(f"{kind}: {link['uri']} in {link['filename']}, line {link['lineno']}: {link['info']}")
    asked = [link for link in found if link["uri"].startswith("http")]
    print(
        f"links: {len(asked)} asked, {len(broken) - len(dead)} without an answer, {len(dead)} dead"
    )
    return 1 if dead else 0


if __name__ == "__main__":
    sys.exit(main())
