texel bake p.opf -o x.texel --unit inch
