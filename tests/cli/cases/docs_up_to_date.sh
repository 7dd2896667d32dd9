# To write it anew: texel --dump-docs > docs/cli.md
texel --dump-docs | diff "$ROOT/docs/cli.md" -
