# Every option of docs/cli.md, which is the table, stands in its command's help, and nothing else does.
for command in bake batch info check view; do
  texel $command --help > help.txt || exit
  awk -v name="## texel $command" '/^## /{inside = $0 == name} inside' "$ROOT/docs/cli.md" | grep -o '^| .*`--[a-z-]*' | grep -o '\-\-[a-z-]*' | sort > table.txt
  grep -o '^  \(-., \)\?--[a-z-]*' help.txt | grep -o '\-\-[a-z-]*' | sort > shown.txt
  diff table.txt shown.txt || exit
  echo "$command: $(wc -l < shown.txt) options"
done
