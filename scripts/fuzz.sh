#!/usr/bin/env bash
# Coverage-guided fuzzing of the codec and of every reader:  scripts/fuzz.sh [CPU-MINUTES, in all; default 30] [TARGET...]
# Exits 1 on a crash, a hang (10 s) or more than 1 GB; what caused it lies in fuzz-findings/.  The corpus stays small.
set -euo pipefail
minutes=${1:-30}
case $minutes in '' | *[!0-9]*) sed -n '2,3s/^# //p' "$0" >&2; exit 2 ;; esac
shift || true
. "$(dirname "$0")/setup.sh"
if ! python -c 'import atheris' 2>/dev/null; then
    echo "== installing the extra 'fuzz'"
    pip install -qq --disable-pip-version-check --constraint constraints.txt --editable '.[fuzz]'
fi
targets=${*:-codec config readings scenario carry_over tle omm oem cpf sp3 aem tracking_parameters}
seconds=$((minutes * 60 / $(wc -w <<<"$targets")))
mkdir -p fuzz-findings
status=0
for target in $targets; do
    grown=$(mktemp -d)
    dictionary=tests/corpus/$target.dict
    echo "== $target: $seconds s"
    if ! python scripts/fuzz.py "$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 -max_len=4096 \
        -artifact_prefix="fuzz-findings/$target-" ${dictionary:+$([ -e "$dictionary" ] && echo "-dict=$dictionary")} \
        -verbosity=0 -print_final_stats=1 "$grown" "tests/corpus/$target" 2>fuzz-findings/"$target".log; then
        echo "$target FAILED:"; tail -n 40 fuzz-findings/"$target".log; status=1
    fi
    grep -E "number_of_executed_units|peak_rss_mb" fuzz-findings/"$target".log || true
    rm -rf "$grown"
done
exit $status
