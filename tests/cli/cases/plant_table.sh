printf '0' > p.dta; texel bake p.dta -o x.texel
