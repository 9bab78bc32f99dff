"""The U walls of Murano et al. as blocks: modes identified from simulated records, and pushes with other joints."""
