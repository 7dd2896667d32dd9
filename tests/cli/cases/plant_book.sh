printf '<package/>' > book.opf; texel bake book.opf -o x.texel
