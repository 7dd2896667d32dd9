printf '<opf><meshBDD>\n<mesh><points>0,5 0 0</points></mesh></meshBDD></opf>' > p.opf; texel bake p.opf -o x.texel
