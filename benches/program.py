"""The product's programs, asked for JSON objects by Python."""

import datetime
import hashlib
import json
import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MODELS = ROOT / "assets" / "models"


class Refused(Exception):
    """The program refused a command; its last words."""


class Program:
    """A program (`touch2touch`, `touch2touch-bench`) at a path; what it keeps lies under `place`."""

    def __init__(self, path, place):
        self.path, self.place = str(path), Path(place).resolve()
        self.environment = {**os.environ, "TOUCH2TOUCH_CACHE": str(self.place / "cache"),
                            "TOUCH2TOUCH_DATA": str(self.place / "kept"), "TOUCH2TOUCH_MODELS": str(MODELS)}

    def run(self, *words):
        """The JSON object of a verb. Exit code 1 is an answer with something missing, and says so in it."""
        return json.loads(self._output(*words, "--json"))

    def write(self, file, *words):
        """The JSON object of a command that writes it, with pictures beside it, to a file."""
        self._output(*words, f"--json={file}")
        return json.loads(Path(file).read_text())

    def _output(self, *words):
        command = [self.path, *map(str, words)]
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1) or not done.stdout:
            raise Refused(f"{' '.join(command)}: {done.stderr.strip()[-600:]}")
        return done.stdout

    def commit(self):
        """The commit that it was built from, as it says itself."""
        done = subprocess.run([self.path, "--version"], env=self.environment, capture_output=True, text=True, check=True)
        return next(line.split(None, 1)[1] for line in done.stdout.splitlines() if line.startswith("commit"))

    def version(self):
        """Version and commit as the program says them, and which file it is."""
        done = subprocess.run([self.path, "--version"], env=self.environment, capture_output=True, text=True, check=True)
        said = ", ".join(" ".join(line.split()) for line in done.stdout.splitlines()[:2])
        return f"{said}, sha256 {hashlib.sha256(Path(self.path).read_bytes()).hexdigest()[:12]}"


def commit():
    """Commit of the working tree, and `+` where the source was changed."""
    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()

    changed = git("status", "--porcelain", "--", "src", "crates", "assets", "training", "Cargo.toml", "Cargo.lock")
    return git("rev-parse", "--short=12", "HEAD") + ("+" if changed else "")


def machine():
    """Processor, its threads, and the load of the last minute."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    model = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown processor")
    return f"{model}, {os.cpu_count()} threads, load {os.getloadavg()[0]:.1f}"


def today():
    return datetime.date.today().isoformat()
