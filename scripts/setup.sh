# Sourced by scripts/demo and scripts/test: makes .venv with the pinned dependencies, once per change of their lists.
# Needs Python 3.11 or newer with venv, nothing else.

cd "$(dirname "${BASH_SOURCE[0]}")/.."
unset PYTHONDONTWRITEBYTECODE # without what is compiled kept, each start of a process takes three times as long
python=${PYTHON:-python3}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || {
    echo "acu-daemon needs Python 3.11 or newer; set PYTHON=/path/to/python3.11" >&2
    exit 2
}
stamp=.venv/stamp-$(cat constraints.txt pyproject.toml scripts/setup.sh | sha256sum | cut -c1-16)
if [ ! -e "$stamp" ]; then
    echo "== setting up .venv (once; about a minute)"
    python=$("$python" -c 'import sys; print(getattr(sys, "_base_executable", sys.executable))') # not the one that goes
    rm -rf .venv
    if ! "$python" -m venv .venv 2>.venv-problem; then
        cat .venv-problem >&2
        rm -rf .venv .venv-problem
        echo "python3 -m venv failed; on Debian: apt-get install python3-venv" >&2
        exit 2
    fi
    rm -f .venv-problem
    echo "== installing dependencies, pinned by constraints.txt"
    .venv/bin/pip install -qq --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
    touch "$stamp"
fi
export PATH="$PWD/.venv/bin:$PATH"
