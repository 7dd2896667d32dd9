printf '1 2 3\n' > s.ops; texel bake s.ops -o x.texel
