printf '<opf>\n<topology>' > p.opf; texel bake p.opf -o x.texel
