# changed_files PATTERN...: changed files of src that match, the last changed first. Sourced by scripts/test.sh.
#
# Compares with the merge base with origin/main. On main itself, as in CI, compares with the last commit that scripts/nightly.sh
# checked as a whole (docs/testing.md), so every gate checks what no nightly run has checked yet. In a clone without that commit
# compares with the previous commit; without any history nothing has changed. Files that are not committed count as changed.

base_of_changes() {
  local base last
  base=$(git merge-base HEAD origin/main 2>/dev/null) || base=
  if [ -z "$base" ] || [ "$base" = "$(git rev-parse HEAD)" ]; then
    last=$(sed -n 's/^| tidy | [^|]* | [^|]* | `\([0-9a-f]*\)`.*/\1/p' docs/testing.md)
    base=$(git merge-base HEAD "${last:-none}" 2>/dev/null || git rev-parse --verify --quiet HEAD~1) || base=
  fi
  echo "$base"
}

changed_files() {
  local base
  base=$(base_of_changes)
  {
    git diff --name-only HEAD -- "$@"
    git ls-files --others --exclude-standard -- "$@"
    [ -z "$base" ] || git log --format= --name-only "$base..HEAD" -- "$@"
  } | awk '!seen[$0]++' | while read -r file; do [ ! -f "$file" ] || echo "$file"; done
}
