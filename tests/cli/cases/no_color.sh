NO_COLOR=1 texel bake missing.obj -o out.texel 2>&1 | od -c | grep -c '033'
exit 0
