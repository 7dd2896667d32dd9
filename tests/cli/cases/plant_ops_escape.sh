printf '1\t1\t../p.opf\t0\t0\t0\t1\t0\t0\t0\n' > s.ops; texel bake s.ops -o x.texel
