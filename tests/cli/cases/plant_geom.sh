printf 'Scene' > p.geom; texel bake p.geom -o x.texel
