echo nothing > v.vdb
texel bake v.vdb -o x.texel
