printf 'CODE:\tFORM-A\n' > p.mtg; texel bake p.mtg -o x.texel
