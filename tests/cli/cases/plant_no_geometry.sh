printf '<opf><topology id="1"><branch/></topology></opf>' > p.opf; texel bake p.opf -o x.texel
