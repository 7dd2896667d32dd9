printf '<!DOCTYPE opf [<!ENTITY a "aaaa">]>\n<opf>&a;</opf>' > p.opf; texel bake p.opf -o x.texel
