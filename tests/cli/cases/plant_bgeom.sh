printf '!bGEOM' > p.bgeom; texel bake p.bgeom -o x.texel
